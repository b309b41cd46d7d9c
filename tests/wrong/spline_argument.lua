-- expect: 4: a curve of string; must be of one number or expression
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1, 2 } }
local y = curve("x")
