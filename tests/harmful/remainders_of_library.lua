-- expect: 5: math.fmod: more than the 100 million steps that reading a model may take
-- Tries the same by math.fmod.
local rd = require "refdyn"
local x, f = 0, math.fmod
for i = 1, 1e9 do x = f(1e308, 1.23e-308) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
