-- expect: 3: text "wrong\x00name": contains control character 0; remove it
local rd = require "refdyn"
return rd.model { name = "wrong\0name", links = { { "a", joint = "x", mass = 1 } } }
