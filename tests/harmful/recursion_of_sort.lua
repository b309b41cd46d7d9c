-- expect: 4: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries to sort within a comparison.
local rd = require "refdyn"
local function f(a, b) table.sort({ 2, 1 }, f); return false end
table.sort({ 2, 1 }, f)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
