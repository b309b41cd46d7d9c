-- expect: 3: rd.spline: sample 2 is not of the form { at, value }, of numbers
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1 } }
