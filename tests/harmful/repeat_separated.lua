-- expect: 4: string.rep: more than the 100 million steps that reading a model may take
-- Tries to repeat an empty text with a long separator.
local rd = require "refdyn"
local s = string.rep("", 1e7, ("x"):rep(1e5))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
