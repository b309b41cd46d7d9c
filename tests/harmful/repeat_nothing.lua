-- expect: 4: string.rep: more than the 100 million steps that reading a model may take
-- Tries to repeat an empty text endlessly.
local rd = require "refdyn"
local s = string.rep("", 1e15)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
