-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to order a long text and itself.
local rd = require "refdyn"
local a, n = ("x"):rep(3e6), 0
for i = 1, 1e7 do if a < a then n = n + 1 end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
