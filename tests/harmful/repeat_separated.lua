-- expect: 4: string.rep: more work than the 100 million steps that a model may take while it is read
-- Tries to repeat an empty text with a long separator.
local rd = require "refdyn"
local s = string.rep("", 1e7, ("x"):rep(1e5))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
