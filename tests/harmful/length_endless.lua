-- expect: 5: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries a length that calls itself.
local rd = require "refdyn"
local events = {}
events.__len = function(t) return #t end
local n = #setmetatable({}, events)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
