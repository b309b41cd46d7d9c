-- expect: 4: stack overflow: a function calls itself endlessly; add a case in which it returns without the call
-- Tries a function that calls itself.
local rd = require "refdyn"
local function f(n) return 1 + f(n + 1) end
f(1)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
