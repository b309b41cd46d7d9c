-- expect: 3: rd.spline: argument 1 is a table, a list of two or more { at, value } is needed; write rd.spline { { 0, 0 }, { 1, 2 } }
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 } }
