-- expect: 3: gravity[3]: value -inf; must be finite
local rd = require "refdyn"
return rd.model { name = "wrong", gravity = { 0, 0, -1e999 }, links = { { "a", joint = "x", mass = 1 } } }
