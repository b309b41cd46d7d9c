-- expect: 4: more than 32 tables nested in each other
local rd = require "refdyn"
local t = {}
for i = 1, 50 do t = { t } end
return rd.model { name = "wrong", links = t }
