-- expect: 3: option f: value inf; must be finite
local rd = require "refdyn"
local f = rd.option("f", 1e400)
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = f } } }
