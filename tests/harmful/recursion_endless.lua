-- expect: 4: stack overflow: a function calls itself without an end; return without a call in the last case
-- Tries a function that calls itself.
local rd = require "refdyn"
local function f(n) return 1 + f(n + 1) end
f(1)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
