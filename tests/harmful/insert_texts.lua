-- expect: 5: table.insert: more work than the 100 million steps that a model may take while it is read
-- Tries to insert in front of a list, at a place that is a text.
local rd = require "refdyn"
local list = {}
for i = 1, 1e6 do table.insert(list, "1", i) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
