-- expect: 3: parameter m: value inf; must be finite
local rd = require "refdyn"
local p = rd.parameters { { "m", 1e400, "kg" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = p.m } } }
