-- expect: 3: name "gravity\x00": contains control character 0; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", ["gravity\0"] = { 0, 0, 0 }, links = { { "a", joint = "x", mass = 1 } } }
