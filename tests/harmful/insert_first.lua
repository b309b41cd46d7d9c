-- expect: 5: table.insert: more than the 100 million steps that reading a model may take
-- Tries to put entries in front of a long list.
local rd = require "refdyn"
local t = {}
for i = 1, 1e6 do table.insert(t, 1, i) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
