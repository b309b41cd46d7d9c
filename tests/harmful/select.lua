-- expect: 6: table.unpack: more than the 100 million steps that reading a model may take
-- Tries select with many arguments, again and again.
local rd = require "refdyn"
local t = {}
for i = 1, 2e5 do t[i] = i end
for i = 1, 1e6 do select("#", table.unpack(t)) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
