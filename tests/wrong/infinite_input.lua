-- expect: 3: input f: value -inf; must be finite
local rd = require "refdyn"
local f = rd.input("f", -1e400)
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = 1 } } }
