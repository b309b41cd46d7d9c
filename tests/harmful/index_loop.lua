-- expect: 6: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries a table that looks in itself.
local rd = require "refdyn"
local t = {}
setmetatable(t, { __index = t })
local n = t.x
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
