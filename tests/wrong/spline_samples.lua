-- expect: 3: rd.spline: argument 1 is a table; must be a list of two or more { at, value }, as in rd.spline { { 0, 0 }, { 1, 2 } }
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 } }
