-- expect: 4: setmetatable: the metatable of rd cannot be changed
-- Tries to change the events of rd.
local rd = require "refdyn"
setmetatable(rd, { __index = function() while true do end end })
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
