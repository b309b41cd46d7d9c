-- expect: 0: setmetatable: __gc was changed after the call; set it before
-- Tries to add a finalizer to a metatable that a table already has.
local rd = require "refdyn"
local events = {}
local kept = setmetatable({}, events)
events.__gc = function() while true do end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
