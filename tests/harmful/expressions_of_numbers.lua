-- expect: 6: more than 100000 different expressions in the model
-- Tries an expression for each number.
local rd = require "refdyn"
local p = rd.parameters { { "m", 1 } }
local n = 0
while true do n = n + 1; local x = p.m + n end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
