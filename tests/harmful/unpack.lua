-- expect: 6: table.unpack: more than the 100 million steps that reading a model may take
-- Tries to unpack a long list again and again.
local rd = require "refdyn"
local t = {}
for i = 1, 2e5 do t[i] = i end
for i = 1, 1e6 do local a = table.unpack(t) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
