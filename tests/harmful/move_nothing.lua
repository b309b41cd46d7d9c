-- expect: 5: table.move: more than the 100 million steps that reading a model may take
-- Tries to move missing entries.
local rd = require "refdyn"
local t = {}
for i = 1, 1e6 do table.move(t, 1, 2^40, 2) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
