-- Tries an error with a long text.
local rd = require "refdyn"
error(("x\n"):rep(1e6))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
