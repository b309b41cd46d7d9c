-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries remainders of numbers that are far apart.
local rd = require "refdyn"
local x, a, b = 0, 1e308, 1.23e-308
for i = 1, 1e9 do x = a % b end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
