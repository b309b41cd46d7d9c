-- expect: 5: C stack overflow: calls, parentheses, tables or blocks are nested too deeply
-- Tries a concatenation that grows.
local rd = require "refdyn"
local events = {}
events.__concat = function(a, b) return a .. b end
local t = setmetatable({}, events) .. "x"
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
