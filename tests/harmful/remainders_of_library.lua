-- expect: 5: math.fmod: more work than the 100 million steps that a model may take while it is read
-- Tries the same by math.fmod.
local rd = require "refdyn"
local x, f = 0, math.fmod
for i = 1, 1e9 do x = f(1e308, 1.23e-308) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
