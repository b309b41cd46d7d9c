-- expect: 3: name "E\x00F": contains control character 0; remove it
local rd = require "refdyn"
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } }, points = { ["E\0F"] = "a" } }
