-- expect: 0: setmetatable: __close was changed after the call; set it before
-- Tries to set the closing function of a metatable after setmetatable.
local rd = require "refdyn"
local events = {}
local last = setmetatable({}, events)
events.__close = function() while true do end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
