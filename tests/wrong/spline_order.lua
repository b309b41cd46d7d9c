-- expect: 3: rd.spline: sample 3 is at 1, finite ascending numbers are needed
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1, 2 }, { 1, 3 } }
