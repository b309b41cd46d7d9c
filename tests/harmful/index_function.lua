-- expect: 5: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries an index by a function that looks again.
local rd = require "refdyn"
local t = {}
setmetatable(t, { __index = function(t, k) return t[k + 1] end })
local n = t[1]
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
