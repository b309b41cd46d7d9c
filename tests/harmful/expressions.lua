-- expect: 6: more than 100000 different expressions in the model
-- Tries an endless number of expressions.
local rd = require "refdyn"
local p = rd.parameters { { "m", 1 } }
local x = p.m
while true do x = x * x + x end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
