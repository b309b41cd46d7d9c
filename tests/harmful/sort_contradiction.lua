-- expect: 6: more than 100 million steps to read the model; look for a loop without an end
-- Tries to sort by an order that contradicts itself.
local rd = require "refdyn"
local t = {}
for i = 1, 1e6 do t[i] = i end
table.sort(t, function(a, b) return true end)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
