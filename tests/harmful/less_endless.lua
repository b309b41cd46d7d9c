-- expect: 5: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries an order that compares again.
local rd = require "refdyn"
local events = {}
events.__lt = function(a, b) return a < b end
local less = setmetatable({}, events) < setmetatable({}, events)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
