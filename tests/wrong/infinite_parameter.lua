-- expect: 3: parameter m: value inf, a finite number is needed
local rd = require "refdyn"
local p = rd.parameters { { "m", 1e400, "kg" } }
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = p.m } } }
