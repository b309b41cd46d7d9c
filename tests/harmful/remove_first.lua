-- expect: 6: table.remove: more than the 100 million steps that reading a model may take
-- Tries to remove entries from the front of a long list.
local rd = require "refdyn"
local t = {}
for i = 1, 1e6 do t[i] = i end
while #t > 0 do table.remove(t, 1) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
