-- expect: 6: more than 100000 different expressions in the model
-- Tries parameters of a long expression, each of which is evaluated.
local rd = require "refdyn"
local p = rd.parameters { { "m", 1 } }
local x = p.m
for i = 1, 50000 do x = rd.sin(x) + i end
for i = 1, 1e6 do rd.parameter("p" .. i, x) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
