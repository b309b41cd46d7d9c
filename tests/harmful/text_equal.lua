-- expect: 6: more than 100 million steps to read the model; look for a loop without an end
-- Tries to compare long texts that differ in the last letter.
local rd = require "refdyn"
local a, b = ("x"):rep(1e6) .. "a", ("x"):rep(1e6) .. "b"
local n = 0
for i = 1, 1e7 do if a == b then n = n + 1 end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
