-- expect: 6: attempt to index a nil value (global 'string')
-- Tries to remove the globals.
local rd = require "refdyn"
local _ENV = {}
local t = { 1, 2 }
local n = string.rep
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
