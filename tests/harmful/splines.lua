-- expect: 4: more than 1000000 values in the model
-- Tries an endless number of splines.
local rd = require "refdyn"
local t = {}
for i = 1, 1000 do t[i] = { i, i * i } end
while true do rd.spline(t) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
