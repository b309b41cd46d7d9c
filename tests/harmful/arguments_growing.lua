-- expect: 4: a function is called with more than 250 arguments for `...`; pass them in a table
-- Tries a call that adds an argument each time.
local rd = require "refdyn"
local function grow(...) return grow(1, ...) end
grow()
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
