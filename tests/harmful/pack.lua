-- expect: 4: string.pack: more than the 100 million steps that reading a model may take
-- Tries to pack a text into a large field.
local rd = require "refdyn"
for i = 1, 1e9 do string.pack("c2000000", "x") end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
