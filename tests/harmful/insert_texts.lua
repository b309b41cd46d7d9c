-- expect: 5: table.insert: more than the 100 million steps that reading a model may take
-- Tries to insert in front of a list, at a place that is a text.
local rd = require "refdyn"
local list = {}
for i = 1, 1e6 do table.insert(list, "1", i) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
