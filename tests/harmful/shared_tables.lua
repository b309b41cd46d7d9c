-- expect: 4: tables nested deeper than 32
-- Tries a table that holds itself many times.
local rd = require "refdyn"
local t = {}
for i = 1, 100 do t[i] = t end
return rd.model { name = "harmful", links = t }
