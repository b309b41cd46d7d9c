-- expect: 4: string.rep: more work than the 100 million steps that a model may take while it is read
-- Tries to repeat an empty text endlessly.
local rd = require "refdyn"
local s = string.rep("", 1e15)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
