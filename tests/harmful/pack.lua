-- expect: 4: string.pack: more work than the 100 million steps that a model may take while it is read
-- Tries to pack a text into a large field.
local rd = require "refdyn"
for i = 1, 1e9 do string.pack("c2000000", "x") end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
