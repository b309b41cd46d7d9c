-- expect: 0: setmetatable: __index was changed after the call; set it before
-- Tries to build such a chain after setmetatable.
local rd = require "refdyn"
local first = {}
local events = { __index = {} }
setmetatable(first, events)
events.__index = first
local n = first.x
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
