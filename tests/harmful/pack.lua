-- expect: 4: more than 100 million steps to read the model, a loop has no end?
-- Tries to pack a text into a large field.
local rd = require "refdyn"
for i = 1, 1e9 do string.pack("c2000000", "x") end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
