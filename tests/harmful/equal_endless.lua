-- expect: 5: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries an equality that compares again.
local rd = require "refdyn"
local events = {}
events.__eq = function(a, b) return setmetatable({}, events) == setmetatable({}, events) end
local same = setmetatable({}, events) == setmetatable({}, events)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
