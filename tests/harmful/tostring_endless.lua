-- expect: 5: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries a text conversion that calls itself.
local rd = require "refdyn"
local events = {}
events.__tostring = function(t) return tostring(t) end
tostring(setmetatable({}, events))
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
