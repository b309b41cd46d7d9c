-- expect: 4: a curve of string, one number or expression is needed
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1, 2 } }
local y = curve("x")
