-- expect: 6: more than 100 million steps to read the model; look for a loop without an end
-- Tries to sort long texts that differ at their ends.
local rd = require "refdyn"
local t, lead = {}, ("a"):rep(1e5)
for i = 1, 1000 do t[i] = lead .. i end
for i = 1, 1e6 do table.sort(t) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
