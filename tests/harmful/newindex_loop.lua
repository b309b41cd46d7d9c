-- expect: 6: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries a table that writes to itself.
local rd = require "refdyn"
local t = {}
setmetatable(t, { __newindex = t })
t.x = 1
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
