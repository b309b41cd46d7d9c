-- expect: 3: rd.spline: sample 2 must be { at, value } with plain numbers
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1 } }
