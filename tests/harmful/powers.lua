-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries powers of numbers.
local rd = require "refdyn"
local x = 0
for i = 1, 1e9 do x = 1.0000000000000002 ^ (1e15 + i) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
