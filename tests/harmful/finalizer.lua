-- expect: 4: setmetatable: __gc is not allowed in a model
-- Tries to run an endless finalizer when Lua ends.
local rd = require "refdyn"
setmetatable({}, { __gc = function() while true do end end })
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
