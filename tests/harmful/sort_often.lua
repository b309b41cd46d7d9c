-- expect: 6: more than 100 million steps to read the model; look for a loop without an end
-- Tries to sort a long list again and again.
local rd = require "refdyn"
local t = {}
for i = 1, 1e6 do t[i] = -i end
for i = 1, 1e6 do table.sort(t) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
