-- expect: 4: setmetatable: the metatable of the globals cannot be changed
-- Tries to change the events of the globals.
local rd = require "refdyn"
setmetatable(_G, nil)
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
