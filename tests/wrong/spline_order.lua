-- expect: 3: rd.spline: sample 3 is at 1; places must be finite and ascend
local rd = require "refdyn"
local curve = rd.spline { { 0, 1 }, { 1, 2 }, { 1, 3 } }
