-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to stay at the bound on memory, so that each step looks for unused memory.
local rd = require "refdyn"
local t, n = {}, 0
for i = 1, 250 do t[i] = ("x"):rep(1e6) .. i end
while true do n = n + 1; t[250] = ("y"):rep(1e6) .. n end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
