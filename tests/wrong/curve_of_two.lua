-- expect: 4: a curve of 2 values; must be of one number or expression
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1, 2 } }
local value = curve(1, 2)
return rd.model { name = "wrong", links = { { "a", joint = "x", mass = value } } }
