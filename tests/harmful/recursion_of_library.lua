-- expect: 4: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries library functions that call each other.
local rd = require "refdyn"
local function f() return (("x"):gsub("x", f)) end
f()
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
