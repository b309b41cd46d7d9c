-- Tries to repeat an empty text with a long separator.
local rd = require "refdyn"
local s = string.rep("", 1e7, ("x"):rep(1e5))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
