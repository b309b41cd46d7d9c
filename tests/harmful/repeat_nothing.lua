-- Tries to repeat an empty text without end.
local rd = require "refdyn"
local s = string.rep("", 1e15)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
